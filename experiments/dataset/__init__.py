"""Pictures of a mesh from many sides under many lights, and how fast its transfer is baked."""
