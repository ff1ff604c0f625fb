"""The public calls of `fracslice`, which build the records of the layers below."""
