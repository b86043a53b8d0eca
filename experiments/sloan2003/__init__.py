"""Transfer compressed by clusters with principal components, after Sloan et al. 2003."""
