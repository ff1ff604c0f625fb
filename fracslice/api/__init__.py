"""What `fracslice` offers by name: short calls that build the records of the layers below."""
