"""The atlas: maps of when learning becomes innate, with laws and claims stated before."""

from baldwinlab.api.atlas.article import write_article
from baldwinlab.api.atlas.publish import publish_atlas
from baldwinlab.api.atlas.run import AtlasRequest, run_atlas

__all__ = [
    "AtlasRequest",
    "publish_atlas",
    "run_atlas",
    "write_article",
]
