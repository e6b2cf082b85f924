"""The elastic template: one face deformed onto another, and the map between them that follows from it."""
