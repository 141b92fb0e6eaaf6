"""What the user does in the viewer."""
