"""Model directives into a plant, by a parser that is given or made for it."""

from ._directives.directives import ModelDirectives
from ._directives.process import DirectivesProcessor, ModelInstanceInfo
from ._files.diagnostics import Location
from ._parser import Parser


def ProcessModelDirectives(directives: ModelDirectives, *args, **kwargs) -> "list[ModelInstanceInfo]":
    """Adds everything the directives say to a plant.

    Call it as `ProcessModelDirectives(directives, parser)` or `ProcessModelDirectives(directives, plant, parser=None)`.

    Returns:
        One entry for every model added, in order.

    Raises:
        RuntimeError: When a name or file is not found, or the plant refuses something.
    """
    given = dict(kwargs)
    unknown = [name for name in given if name not in ("plant", "parser")]
    positional = list(args)
    if positional and isinstance(positional[0], Parser):
        given["parser"] = positional.pop(0)
    elif positional:
        given["plant"] = positional.pop(0)
        if positional:
            given["parser"] = positional.pop(0)
    plant, parser = given.get("plant"), given.get("parser")
    if unknown or positional or (plant is None and parser is None):
        raise TypeError("ProcessModelDirectives() takes (directives, parser) or (directives, plant, parser=None).")
    if parser is None:
        parser = Parser(plant)
    if plant is not None and parser.plant() is not plant:
        raise RuntimeError("ProcessModelDirectives(): the parser belongs to another plant.")
    processor = DirectivesProcessor(parser)
    processor.process(directives, "", Location("ProcessModelDirectives()"))
    parser.finish_filters()
    return processor.added
