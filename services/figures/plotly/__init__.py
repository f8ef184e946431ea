"""Figures for Plotly: on the page, in notebooks and in HTML files."""
