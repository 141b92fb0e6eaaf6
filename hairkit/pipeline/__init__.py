"""From photos to a groom: recipes, stages, the work folder."""
