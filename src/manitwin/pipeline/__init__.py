"""The paper's pipeline: one module a stage, and the recipe that lists them."""
