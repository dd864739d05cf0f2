PYTHON ?= python3
BIN := .venv/bin

# a program that may not keep its bytecode compiles all of this at each start: tests start hundreds
unexport PYTHONDONTWRITEBYTECODE

.PHONY: setup demo test docs vlm-real usd-validate simready lerobot-real browser lint licences vulnerabilities lock lock-vlm-real lock-usd-validate lock-simready lock-lerobot-real clean

setup:
	@$(PYTHON) scripts/setup.py

demo: setup
	@$(BIN)/manitwin build samples/samples.csv -o demo

# one process more than cores, four at most: many tests wait for what they started
WORKERS ?= $(shell cores=$$(nproc); echo $$((cores < 4 ? cores + 1 : 4)))

# a file's tests stay in one process: they share what is dear to make. Files begin in the order of tests/conftest.py
test: setup
	@$(BIN)/python -m pytest -m "not slow" -n $(WORKERS) --dist loadfile --no-loadscope-reorder

# strict: a warning, or a reference that leads nowhere, fails it
docs: setup
	@$(BIN)/python -m sphinx -W --keep-going -n -q -E -b html -d build/doctrees docs build/docs

# the pages of manitwin view and manitwin review, driven as a person would
browser: setup
	@$(BIN)/python scripts/setup_browser.py
	@BROWSER_REQUIRED=1 $(BIN)/python -m pytest -m browser tests/web

vlm-real: setup
	@$(BIN)/python scripts/setup_side_environment.py vlm
	@VLM_REAL_REQUIRED=1 $(BIN)/python -m pytest -m vlm_real tests/vlm_real

usd-validate: setup
	@$(BIN)/python scripts/setup_side_environment.py usd-validate
	@USD_VALIDATOR_REQUIRED=1 $(BIN)/python -m pytest tests/assets/writers/test_usd_validator.py

simready: setup
	@$(BIN)/python scripts/setup_side_environment.py simready
	@SIMREADY_REQUIRED=1 $(BIN)/python -m pytest tests/assets/writers/test_simready.py

lerobot-real: setup
	@$(BIN)/python scripts/setup_side_environment.py lerobot
	@LEROBOT_REQUIRED=1 $(BIN)/python -m pytest tests/episodes/test_real_lerobot.py

lint: setup
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

# of all locked packages: the licence of each, and the vulnerabilities that the package index knows
licences: setup
	@$(BIN)/python scripts/locked_licences.py

vulnerabilities: setup
	@$(BIN)/python scripts/locked_vulnerabilities.py

lock:
	@$(BIN)/uv pip compile --quiet --universal --generate-hashes --python-version 3.11 --extra dev \
	  --no-annotate --no-header --upgrade pyproject.toml -o requirements.lock

lock-vlm-real:
	@$(BIN)/uv pip compile --quiet --universal --generate-hashes --python-version 3.11 --no-annotate --no-header \
	  --override tests/vlm_real/engine.overrides tests/vlm_real/engine.in -o tests/vlm_real/engine.lock

lock-usd-validate:
	@$(BIN)/uv pip compile --quiet --universal --generate-hashes --python-version 3.11 --no-annotate --no-header \
	  tests/assets/writers/usd_validator.in -o tests/assets/writers/usd_validator.lock

lock-simready:
	@$(BIN)/uv pip compile --quiet --universal --generate-hashes --python-version 3.11 --no-annotate --no-header \
	  tests/assets/writers/simready.in -o tests/assets/writers/simready.lock

lock-lerobot-real:
	@$(BIN)/uv pip compile --quiet --universal --generate-hashes --python-version 3.11 --no-annotate --no-header \
	  --override tests/episodes/real_lerobot.overrides tests/episodes/real_lerobot.in \
	  -o tests/episodes/real_lerobot.lock

clean:
	rm -rf .venv .venv-vlm .venv-usd-validate .venv-simready .venv-lerobot demo
