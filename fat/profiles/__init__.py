"""Profiles: sets of shapes that other programs animate faces with, beside MPEG-4's FAPs."""
