"""Cloning the motion of an animatable face onto another mesh."""
