"""From poses of geometries to contact points, surfaces and distances; one file a family of pairs."""
