"""Train a timm network on the shards of a data set with plain PyTorch: examples/train_timm.py INDEX
[--backbone NAME].

All images of a sample are the channels of one input, as grey values. A sample's label is its class.
"""

import argparse

import timm
import torch
from torch.utils.data import DataLoader

from lowalt.shards import ShardSet


class Images(torch.utils.data.Dataset):
    """The images (channels, size, size) float32 in 0..1 and the label of each sample of a fold."""

    def __init__(self, index: str, fold: str, size: int) -> None:
        self.shards = ShardSet(index, folds=[fold])
        self.size = size
        self.labels = self.shards.labels

    def __len__(self) -> int:
        return len(self.shards)

    def __getitem__(self, number: int) -> tuple[torch.Tensor, int]:
        return torch.tensor(self.shards.images(number, size=self.size)) / 255.0, int(
            self.labels[number]
        )


line = argparse.ArgumentParser(description=__doc__)
line.add_argument("index", help="index.json of the data set")
line.add_argument("--backbone", default="resnet18", help="any name of timm")
line.add_argument("--steps", type=int, default=1000)
line.add_argument("--batch", type=int, default=32)
line.add_argument("--size", type=int, default=64, help="pixels of an image's side")
given = line.parse_args()

torch.manual_seed(1)
train, test = (Images(given.index, fold, given.size) for fold in ("train", "val"))
channels = len(train[0][0])
classes = len(train.shards.classes)
network = timm.create_model(given.backbone, in_chans=channels, num_classes=classes)
optimiser = torch.optim.AdamW(network.parameters(), lr=1e-3)

step = 0
while step < given.steps:
    for images, labels in DataLoader(train, given.batch, shuffle=True):
        loss = torch.nn.functional.cross_entropy(network(images), labels)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        step += 1
        if step == given.steps:
            break

network.eval()
with torch.no_grad():
    right = sum(
        int((network(images).argmax(1) == labels).sum())
        for images, labels in DataLoader(test, given.batch)
    )
print(
    f"loss {loss.item():.3f} after {step} steps, {100 * right / len(test):.1f} % of {len(test)}"
    " validation samples"
)
