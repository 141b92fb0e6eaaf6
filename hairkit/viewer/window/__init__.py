"""What the operating system shows of the viewer: window, input, panel."""
