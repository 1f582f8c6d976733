"""Numerical tools that several folders share: kriging, a shrunk covariance, one thread of linear algebra."""
