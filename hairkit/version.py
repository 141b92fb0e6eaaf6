"""The version of hairkit, for rooms that may not use the front door."""

__version__ = "0.3.0"
