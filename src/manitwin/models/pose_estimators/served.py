"""An estimator behind HTTP: the question is posted as JSON with its files in base64, the answer is JSON."""

from __future__ import annotations

import base64

from manitwin.config import ServicesConfig
from manitwin.models.pose_estimators.protocol import PoseGuesses, PoseRequest, parse_guesses
from manitwin.models.services.http import HttpService
from manitwin.models.services.keys import bearer, key_from_environment

KEY = "MANITWIN_POSE_KEY"
PATH = "estimate"


class ServedEstimator:
    """Ask a server of the user's for poses, with the key in the environment variable ``MANITWIN_POSE_KEY`` where there is one.

    The body's ``content`` has the files of the question in base64, by name. Raises what ``HttpService`` does.
    """

    def __init__(self, url: str, services: ServicesConfig):
        """Take the server's address; raises ConfigError for what is none, and where a key may not be sent there."""
        self.spec = url
        key = key_from_environment((KEY,), url, "--estimator", own_server=True)
        self._service = HttpService("estimator", url, authorization=bearer(key), services=services, key=key)

    def guess(self, request: PoseRequest) -> PoseGuesses:
        """Post the question."""
        content = {name: base64.b64encode(each).decode() for name, each in request.files.items()}
        return parse_guesses(self._service.post_json(PATH, {**request.document, "content": content}), "estimator")
