"""What the readers of all formats share: numbers, poses, inertias, looks and contact properties."""
