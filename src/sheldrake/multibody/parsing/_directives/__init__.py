"""Model directives: lists of models and how they are placed, read and carried out."""
