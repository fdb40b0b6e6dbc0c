"""Maximum likelihood by equalisation over the whole image: the default method."""
