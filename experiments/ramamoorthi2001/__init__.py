"""An efficient representation for irradiance environment maps (Ramamoorthi and Hanrahan 2001)."""
