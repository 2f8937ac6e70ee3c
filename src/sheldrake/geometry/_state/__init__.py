"""What a SceneGraph knows: what is registered with it, by whom, in which roles, and what may touch."""
