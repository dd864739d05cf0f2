PYTHON ?= python3
BIN := .venv/bin

.PHONY: setup demo test lint lock clean

setup:
	@$(PYTHON) scripts/setup.py

demo: setup
	@$(BIN)/manitwin build samples/samples.csv -o demo

test: setup
	@$(BIN)/python -m pytest -m "not slow"

lint: setup
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

lock:
	@$(BIN)/uv pip compile --quiet --universal --generate-hashes --python-version 3.11 --extra dev \
	  --no-annotate --no-header --upgrade pyproject.toml -o requirements.lock

clean:
	rm -rf .venv demo
