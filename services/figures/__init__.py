"""One definition of each figure, for the page, the notebook and the file.

A figure is a value (`marks.Figure`): panels of marks (lines with bands, points, levels, bars, arrows, labels), what
their axes are called, a caption that says n and what the bands are, and a sentence for those who cannot see it. `style`
says how marks are told apart, `words` how names and numbers are written. Renderers know marks and nothing else: `chart`
is for Plotly, `html` for a page that needs nothing else, `files` for SVG, PNG and PDF.

To add a figure, write one file here: a function that takes what is to be shown, as schemas or plain values, and gives a
`Figure`; `squared_error` is a short one to begin from. Every renderer then draws it. For its address, add an endpoint
`/figures/NAME` that returns `answer(figure, query)` of `gaplab.api.http.figures`, as those in `api/routes/figures.py`
do; its query is a `Drawing` with parameters of its own.
"""
