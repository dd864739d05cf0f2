"""Vision-language models: ask one question with pictures, and get an answer in a given JSON schema."""
