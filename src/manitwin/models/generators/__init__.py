"""Image or text to a mesh file, behind one job protocol (submit, poll, fetch) that local code and slow services share."""
