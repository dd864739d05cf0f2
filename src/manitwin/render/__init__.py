"""Rendering of twins and scenes with SAPIEN: views, cards, scene images, and annotations drawn on images."""
