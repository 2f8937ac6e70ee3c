"""Proximity properties of shapes with hydroelastic contact, of either library."""


def properties(g, rigid=None, soft=None, slab=None, modulus=1e6, margin=None):
    """The resolution hint of a rigid or soft shape, or the thickness of a soft half space; `g` has geometry's names."""
    p = g.ProximityProperties()
    if rigid is not None:
        g.AddRigidHydroelasticProperties(rigid, p)
    if soft is not None:
        g.AddCompliantHydroelasticProperties(soft, modulus, p)
    if slab is not None:
        g.AddCompliantHydroelasticPropertiesForHalfSpace(slab, modulus, p)
    if margin is not None:
        p.AddProperty("hydroelastic", "margin", margin)
    return p
