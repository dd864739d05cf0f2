from pathlib import Path

import pytest

from manitwin.config import BuildConfig, load_config
from manitwin.errors import ConfigError


def load(tmp_path: Path, text: str) -> BuildConfig:
    path = tmp_path / "run.toml"
    path.write_text(text)
    return load_config(path)


def test_settings_of_a_file_replace_defaults(tmp_path: Path) -> None:
    config = load(tmp_path, "seed = 7\n[candidates]\ncount = 21\n")
    assert config.seed == 7 and config.candidates.count == 21


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sead = 1", "did you mean 'seed'"),
        ("[candidates]\ncuont = 1", "candidates.cuont: unknown setting 'cuont'; did you mean 'count'"),
        ("seed = 'x'", "seed: "),
        ("item_timeout_s = -1", "item_timeout_s: "),
        ("seed = ", "not TOML"),
    ],
)
def test_bad_setting_names_key_and_remedy(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load(tmp_path, text)


def test_missing_file_is_a_config_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="not there"):
        load_config(tmp_path / "none.toml")
