"""Tasks that write themselves: enumerated in scenes, checked by planning, said in words, exported."""
