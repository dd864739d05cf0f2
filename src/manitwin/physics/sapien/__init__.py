"""SAPIEN (PhysX): scenes, bodies, hands, trials."""
