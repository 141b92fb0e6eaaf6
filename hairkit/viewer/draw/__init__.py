"""What the viewer draws, on the GPU or the processor."""
