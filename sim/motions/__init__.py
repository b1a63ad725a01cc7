"""Motion as a function of time: table profiles, poses, carried and free bodies, and their file."""
