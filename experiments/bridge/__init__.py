"""A bridge to another solver: a card's surface, corrected by a few runs there until its values hold there."""
