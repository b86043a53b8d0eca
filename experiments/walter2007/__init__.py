"""Microfacet models for refraction through rough surfaces (Walter et al. 2007)."""
