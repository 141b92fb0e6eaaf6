"""Files: readers, writers and what they share."""
