"""Archives: one file with everything about an experiment or a study, for backup, analysis elsewhere, and import.

An archive is a zip with one member for each exported table (Parquet, or JSON Lines where values are nested), the curves
as `curves.json` for readers without gaplab, and `manifest.json`. The same content gives the same bytes.
"""

from gaplab.services.archives.reading import import_archive as import_archive
from gaplab.services.archives.writing import Archive as Archive
from gaplab.services.archives.writing import export_experiment as export_experiment
from gaplab.services.archives.writing import export_study as export_study
