"""Pictures of twins and scenes."""
