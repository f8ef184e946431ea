"""Reports: a study or an experiment as one document, with a verdict in words.

`content` collects the stored facts and the verdict of `findings`, and `document` arranges both as `blocks`: paragraphs,
tables, figures, in one HTML file. `takehome` is the report with the files of an experiment.
"""
