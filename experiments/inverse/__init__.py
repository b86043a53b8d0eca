"""Light recovered from shading: sun and turbidity, near area lights, their colors."""
