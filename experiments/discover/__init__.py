"""The search for a physical effect that a model lacks: `doe.discrepancy` with the engine as its simulator."""
