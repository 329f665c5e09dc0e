"""
Compile the kernels once, before tests run side by side: else each process compiles them anew.

The files come to lie beside the sources, as those of a first start do.
"""

from control_field.parameters import Parameters
from experience_evaluation.experiment import warm_up
from learner_node.learning.kernel_warm_up import warm_up_kernels


def main() -> None:
    """Load what learner and evaluation compile."""
    print('compiling the kernels (once, a minute)', flush=True)
    warm_up_kernels(Parameters())
    warm_up('ours', 'full')


if __name__ == '__main__':
    main()
