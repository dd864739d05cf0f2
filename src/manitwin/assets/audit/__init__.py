"""Audit of assets: rules that check any asset for physical and formal defects, without a GPU or learned model."""
