"""The studio: a page where a scene is looked at, changed and made. No other package imports trame."""
