"""Figures as files for papers, drawn by matplotlib."""
