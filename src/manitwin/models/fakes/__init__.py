"""Local servers that keep the contracts of services of others, and fail as those do: to test against, and to rehearse."""
