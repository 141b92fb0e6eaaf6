"""The head: template, scalp, signed distance, torso."""
