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


def test_grippers_second_opinion_and_robustness_are_settings(tmp_path: Path) -> None:
    text = """grippers = ["panda", "wsg50_110"]
    [second_opinion]
    jittered = 5
    [robustness]
    friction = [0.8, 1.2]
    """
    config = load(tmp_path, text)
    assert config.grippers == ("panda", "wsg50_110")
    assert config.second_opinion.jittered == 5 and config.second_opinion.enabled
    assert config.robustness.friction == (0.8, 1.2)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sead = 1", "did you mean 'seed'"),
        ("[candidates]\ncuont = 1", "candidates.cuont: unknown setting 'cuont'; did you mean 'count'"),
        ("seed = 'x'", "seed: "),
        ("[run]\nstage_timeout_s = -1", "run.stage_timeout_s: "),
        ("seed = ", "not TOML"),
        ("gripper = 'panda'", "did you mean 'grippers'"),
        ("grippers = []", "grippers: "),
        ("[robustness]\nfriction = [1.4, 0.6]", "robustness: .*friction"),
        ("[robustness]\nforce = [0.0, 1.0]", "robustness: .*force"),
        ("[robustness]\nfragile_share = 0.9", "robustness: .*fragile_share 0.9 is not below robust_share 0.9"),
        ("[robustness]\nerror = 0.5", "robustness.error: "),
        ("[second_opinion]\nshare_of_failed = 1.5", "second_opinion.share_of_failed: "),
    ],
)
def test_bad_setting_names_key_and_remedy(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load(tmp_path, text)


def test_empty_section_of_earlier_settings_is_read_over(tmp_path: Path) -> None:
    assert load(tmp_path, "seed = 3\n[caption]\n[points]\n[finish]\n") == BuildConfig(seed=3)
    with pytest.raises(ConfigError, match="caption"):
        load(tmp_path, "[caption]\nwords = 5\n")


def test_missing_file_is_a_config_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="not found"):
        load_config(tmp_path / "none.toml")
