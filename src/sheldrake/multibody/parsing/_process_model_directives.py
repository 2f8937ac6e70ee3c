"""Model directives into a plant, by a parser that is given or made for it."""

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.multibody.plant import MultibodyPlant

from ._directives.directives import ModelDirectives
from ._directives.process import DirectivesProcessor, ModelInstanceInfo
from ._files.diagnostics import Location
from ._parser import Parser

_DIRECTIVES, _PARSER = instance_of(ModelDirectives), instance_of(Parser)


@overloaded(
    overload(lambda directives, parser: _process(directives, parser), directives=_DIRECTIVES, parser=_PARSER),
    overload(directives=_DIRECTIVES, plant=instance_of(MultibodyPlant), parser=(_PARSER, None)),
)
def ProcessModelDirectives(directives: ModelDirectives, plant, parser: "Parser | None") -> "list[ModelInstanceInfo]":
    """Adds everything the directives say to a plant.

    Call it as `ProcessModelDirectives(directives, parser)` or `ProcessModelDirectives(directives, plant, parser=None)`.

    Returns:
        One entry for every model added, in order.

    Raises:
        RuntimeError: When a name or file is not found, or the plant refuses something; the plant is as before then.
    """
    if parser is None:
        parser = Parser(plant)
    if parser.plant() is not plant:
        raise RuntimeError("ProcessModelDirectives(): the parser belongs to another plant.")
    return _process(directives, parser)


def _process(directives: ModelDirectives, parser: Parser) -> "list[ModelInstanceInfo]":
    processor = DirectivesProcessor(parser)
    with parser.all_or_nothing():
        processor.process(directives, "", Location("ProcessModelDirectives()"))
        parser.finish_filters()
    return processor.added
