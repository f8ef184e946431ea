"""Archives: everything of an experiment or a study in one file, to keep, to analyse elsewhere, and to read back.

An archive is a zip: a member for each exported table, as Parquet, or as JSON Lines where values are nested; the curves
as `curves.json`, for whoever opens it; and `manifest.json`. The same content gives the same bytes.
"""

from gaplab.services.archives.reading import import_archive as import_archive
from gaplab.services.archives.writing import Archive as Archive
from gaplab.services.archives.writing import export_experiment as export_experiment
from gaplab.services.archives.writing import export_study as export_study
