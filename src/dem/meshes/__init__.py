"""Surfaces of triangles: files and parametric shapes, checks, smooth patches, search and contacts."""
