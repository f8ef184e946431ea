"""The use cases of gaplab around its pure core. Start with README.md in this folder."""

from gaplab.services.plugins.folders import look_where_the_environment_says

look_where_the_environment_says()
