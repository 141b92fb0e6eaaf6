"""Cameras: turntable model, projection, silhouette coherence."""
