"""A pose estimator behind HTTP: the request is posted as JSON with its files in base64, the answer is JSON."""

from __future__ import annotations

import base64

from manitwin.config import ServicesConfig
from manitwin.models.pose_estimators.protocol import PoseGuesses, PoseRequest, parse_guesses
from manitwin.models.services.http import HttpService
from manitwin.models.services.keys import bearer, key_from_environment

KEY = "MANITWIN_POSE_KEY"
PATH = "estimate"


class ServedEstimator:
    """Client of a user's server for pose estimation; the optional key is in the environment variable ``MANITWIN_POSE_KEY``.

    The field ``content`` of the body has the files of the request in base64, by name. Raises the errors of ``HttpService``.
    """

    def __init__(self, url: str, services: ServicesConfig):
        """Take the server's address; raises ConfigError if it is invalid, or if a key may not be sent there."""
        self.spec = url
        key = key_from_environment((KEY,), url, "--estimator", own_server=True)
        self._service = HttpService("estimator", url, authorization=bearer(key), services=services, key=key)

    def guess(self, request: PoseRequest) -> PoseGuesses:
        """Post the request and parse the answer."""
        content = {name: base64.b64encode(each).decode() for name, each in request.files.items()}
        return parse_guesses(self._service.post_json(PATH, {**request.document, "content": content}), "estimator")
