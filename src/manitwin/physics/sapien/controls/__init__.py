"""Hand controllers of robots in episodes: parallel jaws, multi-finger hands, suction cups."""
