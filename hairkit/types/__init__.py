"""Frozen types that travel between stages; see each module."""
