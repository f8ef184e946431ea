"""Archives: one file with everything about a study, for backup, analysis elsewhere, and import.

An archive is a zip of one SQLite database with the tables of the service and one study in it. `gaplab serve` opens the
database, and other programs read it with SQL. The same content gives the same bytes.
"""

from gaplab.services.archives.reading import import_archive as import_archive
from gaplab.services.archives.writing import Archive as Archive
from gaplab.services.archives.writing import export as export
