"""Safe readers and writers of mesh, picture and document files."""
