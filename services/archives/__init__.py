"""Archives: one file with everything about a study, for backup, analysis elsewhere, and import.

An archive is a zip with one member for each exported table: Parquet, or JSON Lines where values are nested. For readers
without gaplab it has the curves as `curves.json`, and the spec to submit again as `spec.json`. `manifest.json` lists
all members. The same content gives the same bytes.
"""

from gaplab.services.archives.reading import import_archive as import_archive
from gaplab.services.archives.writing import Archive as Archive
from gaplab.services.archives.writing import export as export
