"""Task generation: enumerate tasks in scenes, check them by planning, write instructions, and export them."""
