"""Creation of chat clients from the argument of a spec: ``MODEL``, ``MODEL@URL``, or a recorded file."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

from manitwin.config import BuildConfig
from manitwin.errors import ConfigError
from manitwin.models.services.keys import key_from_environment, split_url
from manitwin.models.vlm.answer_cache import CachedChat, default_folder
from manitwin.models.vlm.anthropic_messages import ANTHROPIC_URL, AnthropicMessages
from manitwin.models.vlm.client import ChatClient
from manitwin.models.vlm.openai_chat import OPENAI_URL, OpenAiChat
from manitwin.models.vlm.replay import RecordedChat, Replay

# a vendor's key is sent to the vendor's host only; other servers have a separate variable
KEY_OF_HOST = {
    "api.openai.com": "OPENAI_API_KEY",
    "api.anthropic.com": "ANTHROPIC_API_KEY",
    "generativelanguage.googleapis.com": "GEMINI_API_KEY",
}
KEY_OF_OTHERS = "MANITWIN_VLM_KEY"

NO_CHAT = "none"


def chat_of(spec: str, use: str) -> ChatClient | None:
    """Return the chat client of a whole spec (``openai:MODEL@URL``), None for ``none``; ``use`` is its purpose, for messages.

    Raises ConfigError for a spec that names no model, and the errors of ``openai_from_spec``.
    """
    name, _, argument = spec.partition(":")
    made = {"openai": openai_from_spec, "anthropic": anthropic_from_spec, "replay": replay_from_spec}
    if spec == NO_CHAT:
        return None
    if name not in made:
        raise ConfigError(f"vlm {spec!r}: cannot {use}; give openai:MODEL@URL, anthropic:MODEL, replay:FILE or none")
    return made[name](argument, BuildConfig())


def openai_from_spec(argument: str, config: BuildConfig) -> ChatClient:
    """Return the client of ``MODEL`` or ``MODEL@URL`` for the chat completions API.

    It is cached (``services.cache``) and recorded (``services.record``) as the settings say. Raises ConfigError without a
    model, key or price.
    """
    return _served(OpenAiChat, argument, OPENAI_URL, config)


def anthropic_from_spec(argument: str, config: BuildConfig) -> ChatClient:
    """Return the client of ``MODEL`` or ``MODEL@URL`` for the Messages API; otherwise like ``openai_from_spec``."""
    return _served(AnthropicMessages, argument, ANTHROPIC_URL, config)


def replay_from_spec(argument: str, config: BuildConfig) -> ChatClient:
    """Return a client that replays the answers recorded in a file; raises ConfigError for an invalid record."""
    if not argument:
        raise ConfigError("replay needs the file of recorded answers: replay:answers.jsonl")
    return Replay(Path(argument))


def _served(
    kind: type[OpenAiChat] | type[AnthropicMessages], argument: str, default_url: str, config: BuildConfig
) -> ChatClient:
    """Create the client of a served model, with cache and record as the settings say."""
    model, url = split_url(argument)
    if not model:
        raise ConfigError(
            f"{kind.name} needs a model: {kind.name}:MODEL, or {kind.name}:MODEL@URL for another server than {default_url}"
        )
    url = (url or default_url).removesuffix(kind.endpoint)
    key_name = KEY_OF_HOST.get(urlsplit(url).hostname or "", KEY_OF_OTHERS)
    own_server = key_name == KEY_OF_OTHERS
    key = key_from_environment((key_name,), url, f"{kind.name}:{argument}", own_server=own_server)
    chat: ChatClient = kind(model, url, key, config.vlm, config.services, key_name=key_name)
    if config.services.cache:
        chat = CachedChat(chat, default_folder())
    return chat if config.services.record is None else RecordedChat(chat, config.services.record)
