"""The use cases of gaplab around its pure core. Start with README.md in this folder."""
