"""What people touch: the command line, pictures, reports."""
