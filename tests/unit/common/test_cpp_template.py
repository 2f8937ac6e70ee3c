import warnings

import numpy as np
import pytest

from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch
from sheldrake.common.cpp_param import Dict, List, Optional, Union, get_param_canonical, get_param_names
from sheldrake.common.cpp_template import TemplateClass, TemplateFunction, TemplateMethod, get_or_init
from sheldrake.common.deprecation import DrakeDeprecationWarning, deprecated, deprecated_callable

made = []


@TemplateClass.define("Box_", param_list=[(float,), (str,)])
def Box_(param):
    (T,) = param
    made.append(T)

    class Impl:
        def __init__(self, value):
            if not isinstance(value, T):
                raise Mismatch("incompatible constructor arguments")
            self.value = value

    return Impl


def test_instantiations_are_made_when_first_asked():
    made.clear()
    fresh = TemplateClass("Fresh_")
    fresh.add_instantiations(lambda param: made.append(param) or type("Impl", (), {}), [(float,), (int,)])
    assert made == []
    assert fresh[float] is fresh[float] is fresh[None] is fresh[[float]]
    assert made == [(float,)]


def test_names_are_mangled_and_picklable():
    cls = Box_[str]
    assert cls.__name__ == "Box_𝓣str𝓤"
    assert pretty_class_name(cls) == "Box_[str]"
    assert globals()[cls.__name__] is cls
    assert str(Box_) == f"<TemplateClass {__name__}.Box_>"


def test_call_deduces_the_instantiation():
    assert type(Box_("a")) is Box_[str]
    assert type(Box_(2.0)) is Box_[float]
    with pytest.raises(TypeError, match="No compatible"):
        Box_([])
    with pytest.raises(TypeError, match="without arguments"):
        Box_()


def test_errors_from_within_are_not_taken_for_arguments_of_the_wrong_type():
    family = TemplateClass("Broken_")

    def broken(*args):
        raise TypeError("incompatible function arguments, deep inside")

    family.add_instantiation((float,), broken)
    family.add_instantiation((str,), lambda *args: "reached")
    with pytest.raises(TypeError, match="deep inside"):
        family(1.0)


def test_membership():
    derived = type("Derived", (Box_[float],), {})
    assert Box_.is_instantiation(Box_[float]) and not Box_.is_instantiation(derived)
    assert Box_.is_subclass_of_instantiation(derived) is Box_[float]
    assert Box_.is_subclass_of_instantiation(int) is None
    assert Box_.get_param_set(Box_[float]) == {(float,)}


def test_errors():
    with pytest.raises(RuntimeError, match=r"Invalid instantiation: Box_\[bytes\]"):
        Box_[bytes]
    assert Box_.get_instantiation(bytes, throw_error=False) == (None, (bytes,))
    with pytest.raises(RuntimeError, match="already registered"):
        Box_.add_instantiation(float, int)
    with pytest.raises(RuntimeError, match="multiple times"):
        Box_.add_instantiations(lambda param: int, [])


def test_functions_and_methods():
    class Host:
        pass

    function = TemplateFunction("function")
    function.add_instantiation(float, lambda x: 2.0 * x)
    assert function[float](3.0) == 6.0
    assert function[float].__name__ == "function𝓣float𝓤"
    method = TemplateMethod("method", Host)
    method.add_instantiation(int, lambda self, x: (self, x))
    Host.method = method
    host = Host()
    assert host.method[int](3) == (host, 3)
    assert str(Host.method) == "<unbound TemplateMethod Host.method>"
    with pytest.raises(RuntimeError, match="Read-only"):
        host.method = 3


def test_get_or_init():
    class Scope:
        pass

    assert get_or_init(Scope, "A_", TemplateClass) is get_or_init(Scope, "A_", TemplateClass)


def test_deprecated_instantiation_warns():
    template = TemplateClass("Old_")
    template.add_instantiation(int, type("Impl", (), {}))
    template[int]  # as it is known from then on
    template.deprecate_instantiation(int, "Use float.", date="2038-01-19")
    for _ in range(2):
        with pytest.warns(DrakeDeprecationWarning, match="Use float. .* after 2038-01-19"):
            template[int]
    with pytest.raises(RuntimeError, match="already registered"):
        template.deprecate_instantiation(int, "again", date="2038-01-19")


def test_canonical_parameters():
    assert get_param_canonical([np.double, np.int32, np.int64, str]) == (float, int, np.int64, str)
    assert get_param_names([int, List[float], Dict[str, int], 3]) == ("int", "list[float]", "dict[str,int]", "3")
    assert get_param_names([Optional[int]]) == ("typing.Optional[int]",)
    assert get_param_names([Union[int, str]]) == ("typing.Union[int,str]",)
    assert List[np.double] == list[float]
    with pytest.raises(RuntimeError, match="exactly 2"):
        Dict[str]


def test_deprecation_decorators():
    class Host:
        @deprecated("Use y.", date="2038-01-19")
        @property
        def x(self):
            return 1

    @deprecated_callable("Use g.", date="2038-01-19")
    def f(x):
        return x

    with warnings.catch_warnings():
        warnings.simplefilter("always", DrakeDeprecationWarning)
        with pytest.warns(DrakeDeprecationWarning, match="Use y"):
            assert Host().x == 1
        with pytest.warns(DrakeDeprecationWarning, match="Use g"):
            assert f(2) == 2
    with pytest.raises(AssertionError):
        deprecated_callable("no date")(f)


def test_every_template_shows_itself_as_one_of_pydrakes():
    from sheldrake.math import RotationMatrix_
    from sheldrake.systems.framework import BasicVector_

    assert str(BasicVector_) == "<TemplateClass sheldrake.systems.framework.BasicVector_>"
    assert str(RotationMatrix_) == "<TemplateClass sheldrake.math.RotationMatrix_>"
